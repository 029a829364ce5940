"""What is subtracted from readings: the weight of a tool with the sensor's bias, and a tare."""
