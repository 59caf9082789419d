"""What each verb does: calls its job, shows what came of it, and returns the exit status. One file per verb, with a
function of its name."""
