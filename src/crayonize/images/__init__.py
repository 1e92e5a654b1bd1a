"""Picture files: photos become linear light, drawings become picture files."""
