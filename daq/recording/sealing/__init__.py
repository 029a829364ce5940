"""What makes a recording complete: index and footer, or a new file of what can be used, and the loss."""
