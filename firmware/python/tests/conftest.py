"""The shipped models, and a flight that the tests fly."""

import pathlib

import bnkf
import pytest

MODELS = pathlib.Path(__file__).parents[3] / "models"


@pytest.fixture(scope="session")
def model():
    return bnkf.Model(MODELS / "recursive.bnkf")


@pytest.fixture(scope="session")
def memoryless():
    return bnkf.Model((MODELS / "bnkf.bnkf").read_bytes())
