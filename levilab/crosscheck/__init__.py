"""Simulate → acquire through the real drivers → analyze, many times: are the estimates and their uncertainties true?"""
