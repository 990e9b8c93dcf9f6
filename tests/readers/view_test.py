"""Tests the live page in a browser and with misbehaving clients. One test: view_test.py Skin.test_…"""
import merkel_program
from view_actions import Actions
from view_control import Control
from view_first_screen import FirstScreen
from view_health import Health
from view_protocol import Peers, Protocol
from view_skin import Skin

TESTS = (Protocol, Peers, Control, FirstScreen, Skin, Health, Actions)

if __name__ == "__main__":
    merkel_program.main()
