"""Recipes: the steps that a model goes through, from a TOML file or one line of text.

A step has the name and the options of its command (:data:`mracad.options.STEPS`).  Everything that can be wrong in a
recipe is found before a model is read, and named with its place::

    [[step]]
    use = "smooth"
    scale = "2%"

    [[step]]
    use = "check"
    max-gap = "0.01mm"
"""

from __future__ import annotations

from mracad.recipe.reference import page, schema
from mracad.recipe.steps import Step, record_of, title, versions
from mracad.recipe.values import options
from mracad.recipe.written import Recipe, load, pipeline

__all__ = ["Recipe", "Step", "load", "options", "page", "pipeline", "record_of", "schema", "title", "versions"]
