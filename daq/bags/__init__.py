"""Recordings of other programs: rosbag2 folders, and MCAP or SQLite3 files of ROS messages, as tables."""
