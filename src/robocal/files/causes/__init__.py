"""What explains a misfit, in the words of the files: the change that people make by mistake, and the line to write."""
