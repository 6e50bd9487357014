"""What travels: keys, messages, their encoding and checks. No session is needed."""
