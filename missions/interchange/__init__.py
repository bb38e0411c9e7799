"""Set-ups of other stacks: the robots of Crazyswarm2 become a mission's, and a mission's become Crazyswarm2's."""
