"""Force sensors on a CAN bus: requests, a poller, and what their drivers share."""
