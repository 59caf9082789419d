"""Paths of elementary transforms: what serial arms, frames and turntables are made of."""
