"""Systems as pictures: block diagrams and mechanisms."""
