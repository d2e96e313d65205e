"""View factors in closed form: diffuse exchange between simple shapes, with their sources. Float64, by NumPy.

A line that leaves area A1 and ends on A2 has the measure cos1 cos2 / (pi r^2) dA1 dA2. Its integral is the exchange
A1 F12 = A2 F21. A convex body of area A is hit by lines of the measure A in all. So a shape within another one takes
part in no more exchange, and a shape that hides takes away no less the larger it is.

The second ways that check these formulas are in ``tests/validation/oracle/test_view_factors.py``.
"""
