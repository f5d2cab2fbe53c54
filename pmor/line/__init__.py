"""Line contact: law of a line load, tip corners, placing of sections, line loads as unknowns, full FE beside them."""
