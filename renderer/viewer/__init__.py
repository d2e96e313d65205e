"""The interactive viewer: a server on this machine, and one page in the browser that shows what it renders.

Needs the packages of the extra ``viewer``; nothing else of ``renderer`` imports it.
"""
