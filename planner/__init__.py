"""How to fly: the offline planner. Pure: no hardware, no files, no printing."""
