"""Tables, plots and pictures: data frames in, files out."""
