"""Recipes of the synthetic datasets, one module each, called as its dataset; `recipe` says what they return."""
