"""The panels: each takes the gui, the workbench and a way to ask for work; none computes anything."""
