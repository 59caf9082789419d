"""Serial arms: chains of elementary transforms, the conventions that write them, inverse kinematics, a catalogue."""
