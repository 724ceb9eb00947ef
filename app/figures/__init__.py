"""Figures of results, one a file: from records to plotly figures. They compute nothing that is not drawn."""
