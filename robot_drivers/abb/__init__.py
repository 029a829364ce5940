"""ABB IRB 140 on an IRC5 controller: moved by a RAPID server, measured through EGM; with an emulator."""
