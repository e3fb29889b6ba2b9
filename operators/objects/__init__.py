"""A Blender object to plain arrays and back, and the settings that it keeps."""
