"""``python -m gms_fsm`` is the command ``gms-fsm``."""

from gms_fsm.app.cli import main

main()
