"""An octopus that crawls over the sea floor and takes on its looks."""
