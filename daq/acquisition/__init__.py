"""The acquisition process: devices, guard, recorder and session apart from whatever window or script controls them.

A client (:class:`daq.acquisition.client.Acquisition`) starts the process and talks to it over its standard input and
output, in the typed messages of :mod:`daq.acquisition.messages`; nobody else can. The rules:

- The process opens with one :class:`~daq.acquisition.messages.Open`, connects the devices and answers
  :class:`~daq.acquisition.messages.Opened`, in which it names the version of the messages that it speaks. Nothing
  moves.
- The client shows that it is alive by calling :meth:`~daq.acquisition.client.Acquisition.poll` at least twice a second
  (a window from a timer of its event loop, so that a frozen window is a silent client). A client that is silent for
  0.8 s, or gone, while a session runs has the robot held; what is being recorded is sealed. When the client is gone
  the process ends, after that. Of an emulated laboratory one that is slow because the computer is busy is not silent:
  what it waits for a processor does not count (:mod:`daq.acquisition.silence`), up to 2 s without a sign of life.
- Thirty times a second the process sends :class:`~daq.acquisition.messages.Telemetry`: the state in words, the
  progress by step, the counts of every stream, the latest samples decimated to 200 Hz, and a small copy of each
  camera's latest image; with or without a session. Only the newest is kept for a client that does not keep up.
- Between sessions a client may have a trajectory checked from where the robot stands, and at any time ask for a zero of
  the force sensor, which changes nothing that is recorded, and for both cameras' full images of one moment.
- :class:`~daq.acquisition.messages.Start` begins a session, which ends with :class:`~daq.acquisition.messages.Ended`.
  ``Hold`` is the software stop, and works at any time; after it only ``Release`` lets the robot move again.
"""
