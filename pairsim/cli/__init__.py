"""The command line: parses arguments and calls the layers below.

Large libraries are imported inside the commands, so that --help and input errors are printed at once.
"""
