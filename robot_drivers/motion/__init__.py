"""How tools move, whatever the arm: poses, straight lines at a bounded speed, arrival, what a path may not exceed."""
