"""Friction models as charts: each module is data for one model, with its reference."""

from gms_fsm.charts.gms import GMS_ELEMENT, LAWS, SLIP_LAWS, gms_element
from gms_fsm.charts.lugre import LUGRE

__all__ = ["GMS_ELEMENT", "LAWS", "LUGRE", "SLIP_LAWS", "gms_element"]
