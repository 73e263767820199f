"""Sets of facial expressions with PAD annotations: landmark files, and a pseudo database made on the avatar."""
