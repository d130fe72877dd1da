"""Optical camera communication between vehicles, for ROS 2: messages and poses of LED panels from an image topic."""
