"""The pair in motion: responses over the speed under several torques, run-ups and run-downs, pictures and a page."""
