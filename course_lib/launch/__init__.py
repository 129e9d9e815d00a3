"""The learner's machine: opening JupyterLab, copies of lessons and labs in my_work/, the data verbs, and the doctor."""
