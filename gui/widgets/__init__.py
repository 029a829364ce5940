"""What the pages are made of; a widget renders what it is given and knows no page."""
