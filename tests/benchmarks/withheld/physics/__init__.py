"""Elasticity, flexure, payload and play out of MuJoCo: truths that no formula of this project has a part in."""
