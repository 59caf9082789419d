"""Trapezoids of speed towards a goal that may move."""
