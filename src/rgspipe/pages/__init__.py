"""Pages for people, each one HTML file that holds its pictures. Reads no artifact and renders no scene."""
