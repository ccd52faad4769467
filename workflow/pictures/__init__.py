"""What figures and files for ParaView are made with, whatever they show."""
