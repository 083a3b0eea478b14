"""Speed against error: our simulator and our pulse analysis, each beside what others would use."""
