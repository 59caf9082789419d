"""The verbs of cable robots: a file each, `NAME_page.py` for its report, and what several of them take (`load.py`)."""
