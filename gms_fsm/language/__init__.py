"""The expression language: texts to checked trees and back. Nothing here knows of friction."""
