"""A motor with cogging, friction and an encoder, under a controller: what its log would record, and the truth beside it."""
