"""The live run: measurements aligned, recorded, estimated from, and watched."""
