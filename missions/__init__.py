"""What to fly: mission files and the records they are parsed into."""
