"""Light on the sheet: Kubelka-Munk colour, relief and sheen, and pictures reduced by area."""
