"""report.html: one self-contained page that a metrologist can hand over (`page.render`), and a picture for elsewhere
(`pictures.before_after`). Only `files` writes them."""
