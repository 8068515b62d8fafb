"""The form of a ROS 2 bag: MCAP and SQLite files, CDR messages, published definitions."""
