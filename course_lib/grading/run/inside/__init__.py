"""What runs inside the sandbox; nothing here decides about points, and nothing here is trusted."""
