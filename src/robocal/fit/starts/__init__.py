"""Closed-form starts, so that nobody must guess where the instrument stands.

`search` finds starts for one instrument in the registry of `seen`, by its kind; every combination is refined with
frames and targets alone, all as one batch, and the cheapest is kept: a mirror or local minimum would have to fool all
of them. `frames` starts instruments that see a frame, `cameras` those that know only directions,
`places` places that the tool touches.
"""
