"""What runs cover of an arrangement, and short runs that cover what can be covered."""
