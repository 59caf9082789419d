"""Cable robots in files: `robot.py` reads any description of one, `lists.py` lists of poses, lengths and tensions."""
