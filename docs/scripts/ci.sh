mracad recipe check recipe.toml
mracad batch recipe.toml models -O out --junit models.xml
mracad compare models/assembly.step out/assembly.step --max-deviation 1% --junit compared.xml
