"""The version of the package, which setuptools reads here."""

__version__ = "0.1.0"
