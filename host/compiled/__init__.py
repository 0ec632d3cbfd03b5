"""What runs over all rows of a recording, in machine code where there is a C compiler."""
