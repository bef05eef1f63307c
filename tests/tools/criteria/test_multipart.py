"""Criteria of the multipart scenes, on painted frames."""

import numpy as np
import pytest

from tests.tools.criteria.scenes import blank, painted
from tools.criteria import multipart as criteria
