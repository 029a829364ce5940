"""What is left of damaged recordings: found chunk by chunk, named, counted, and written anew."""
