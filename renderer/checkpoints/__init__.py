"""Long studies and pictures, kept on disk part by part."""
