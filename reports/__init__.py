"""Tables, plots and pictures: data frames in, files out."""

if __name__ != "trackmark.reports":
    raise ImportError("Import `trackmark.reports` instead of `reports`.")
