"""The version of this package, which releases and what is kept on disk are named by."""

__version__ = "0.1.0"
