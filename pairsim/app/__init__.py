"""The application: the commands, and the functions of Python that compute, draw and report.

Large libraries are imported where a command needs them, so that --help and input errors are printed at once.
"""
