const says = document.getElementById('e-stop'), began = performance.now()
const say = (words, color) => {
  says.textContent = `${new Date().toLocaleTimeString()}  ${words}`
  says.style.background = color
}
const own = 'stop the robot at its own switch'
say('E-STOP: asking the robot', '#8a6100')
fetch(url, {method: 'POST', keepalive: true, signal: AbortSignal.timeout(3000)})
  .then(answer => answer.ok ? answer.text() : Promise.reject(answer.status))
  .then(why => why ? say(`E-STOP: ${why}`, '#b00020') : say('E-STOP: the robot answered after '
    + `${Math.round(performance.now() - began)} ms`, '#1f6f3a'))
  .catch(error => say(`E-STOP: leo watch does not answer (${error}): ${own}`, '#b00020'))
