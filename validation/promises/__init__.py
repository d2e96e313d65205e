"""Promises of the public contract, each kept or broken by answers that a closed form or another library gives."""
