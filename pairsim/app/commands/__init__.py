"""The commands that are not those of questions, a file each, which is imported when its command is called.

The docstring of a file is the help of its command, `EXAMPLES` what stands at the end of it; the function has the name
of the file. Large libraries are imported inside it, so that help and mistakes in the input are printed at once.
"""
