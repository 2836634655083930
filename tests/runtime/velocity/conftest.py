"""Robots shared by the tests of joint rates."""

import pytest

import chasles


@pytest.fixture(scope="module")
def ur5e():
    return chasles.load("ur5e")


@pytest.fixture(scope="module")
def panda():
    return chasles.load("panda")
