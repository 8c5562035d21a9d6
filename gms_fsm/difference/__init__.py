"""What two charts, models, systems or runs differ in."""
