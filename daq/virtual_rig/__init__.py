"""A laboratory on the loopback interface: emulated devices around a simulated phantom, in processes of their own."""
